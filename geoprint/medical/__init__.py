"""Label volumes of medical imaging: segmentations in NIfTI, NRRD and DICOM files."""
