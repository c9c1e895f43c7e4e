"""Work that is shared with processes beside this one."""

from geoprint.pipeline.processes.beside import (
    OtherProcesses as OtherProcesses,
    beside as beside,
    shared as shared,
)
