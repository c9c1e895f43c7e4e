"""Files become meshes: formats of meshes, archives, label volumes, point clouds, and those that features read."""

from geoprint.geometry.files.io import (
    labels_of as labels_of,
    load as load,
    load_file as load_file,
    load_likely as load_likely,
    ply_bytes as ply_bytes,
    read_volume as read_volume,
    rebuilt_in_words as rebuilt_in_words,
    save_ply as save_ply,
    suggested_unit as suggested_unit,
    unit_hint as unit_hint,
    unit_readings as unit_readings,
    write_whole as write_whole,
)
from geoprint.geometry.files.mesh_file import (
    LONGEST_NAME as LONGEST_NAME,
    LabelFound as LabelFound,
    MeshFile as MeshFile,
    region_faces as region_faces,
    stored_mesh as stored_mesh,
)
