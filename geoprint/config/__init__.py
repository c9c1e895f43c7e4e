"""Job and cell: TOML and command-line values in, validated model values out. Degrees end here.

Unknown keys, wrong types, NaN and infinity are refused with the key's name, so that a typing error never becomes a
default.
"""

from geoprint.config.cells import (
    PACKAGED_CELLS as PACKAGED_CELLS,
    TILTING_CELL as TILTING_CELL,
    cell_of as cell_of,
    cell_text as cell_text,
    load_cell as load_cell,
    packaged_cell_text as packaged_cell_text,
)
from geoprint.config.curve_table import read_curve as read_curve
from geoprint.config.field_file import (
    FIELD_EXAMPLE as FIELD_EXAMPLE,
    FieldFile as FieldFile,
    PreferenceTable as PreferenceTable,
    StoredField as StoredField,
    ThroughTable as ThroughTable,
    WallTable as WallTable,
    WidthTable as WidthTable,
    read_field as read_field,
    stored_field as stored_field,
)
from geoprint.config.job import Job as Job
from geoprint.config.job_cell import (
    STAND_DECIMALS as STAND_DECIMALS,
    job_cell as job_cell,
    standing as standing,
)
from geoprint.config.job_file import (
    job_file_text as job_file_text,
    job_named as job_named,
    job_of as job_of,
    job_text as job_text,
)
from geoprint.config.layer_pattern import LayerPattern as LayerPattern
from geoprint.config.needles import (
    Needle as Needle,
    common_needles as common_needles,
    needle_keys as needle_keys,
    needle_of as needle_of,
    with_needle as with_needle,
)
from geoprint.config.patch_region import PatchRegion as PatchRegion
from geoprint.config.source import Source as Source, source_named as source_named
