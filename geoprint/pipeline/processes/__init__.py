"""Work that is shared with processes beside this one."""

from geoprint.pipeline.processes.beside import (
    Beside as Beside,
    beside as beside,
)
