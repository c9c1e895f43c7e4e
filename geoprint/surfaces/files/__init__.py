"""Files become meshes: formats of meshes, archives, CAD, label volumes, point clouds."""

from geoprint.surfaces.files.io import (
    labels_of as labels_of,
    load as load,
    load_file as load_file,
    load_likely as load_likely,
    ply_bytes as ply_bytes,
    rebuilt_in_words as rebuilt_in_words,
    save_ply as save_ply,
    suggested_unit as suggested_unit,
    unit_hint as unit_hint,
    write_whole as write_whole,
)
from geoprint.surfaces.files.mesh_file import LabelFound as LabelFound, MeshFile as MeshFile, stored_mesh as stored_mesh
from geoprint.surfaces.files.optional_readers import read_volume as read_volume
from geoprint.surfaces.files.regions import (
    LONGEST_NAME as LONGEST_NAME,
    region_faces as region_faces,
)
