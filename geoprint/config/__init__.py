"""Job and cell: TOML and command-line values in, validated model values out. Degrees end here.

Unknown keys, wrong types, NaN and infinity are refused with the key's name, so that a typing error never becomes a
default.
"""

from geoprint.config.cells import (
    PACKAGED_CELLS as PACKAGED_CELLS,
    PLACEMENT_DECIMALS as PLACEMENT_DECIMALS,
    TILTING_CELL as TILTING_CELL,
    UR_CELL as UR_CELL,
    Needle as Needle,
    cell_at as cell_at,
    cell_of as cell_of,
    cell_text as cell_text,
    common_needles as common_needles,
    job_cell as job_cell,
    load_cell as load_cell,
    needle_keys as needle_keys,
    needle_of as needle_of,
    packaged_cell_text as packaged_cell_text,
    with_needle as with_needle,
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
from geoprint.config.job import (
    Job as Job,
    PatchRegion as PatchRegion,
    SourceTable as SourceTable,
    source_named as source_named,
)
from geoprint.config.job_file import (
    job_file_text as job_file_text,
    job_of as job_of,
    job_text as job_text,
)
