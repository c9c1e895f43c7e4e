"""RAPID: written, read, executed and verified; what reads and executes shares no code with the writer."""

from geoprint.export.rapid.cell_module import check_cell as check_cell
from geoprint.export.rapid.controller_files import (
    CONTROLLER_FOLDER as CONTROLLER_FOLDER,
    controller_files as controller_files,
)
from geoprint.export.rapid.executed import Executed as Executed, Proof as Proof, check_times as check_times
from geoprint.export.rapid.expected import expected_events as expected_events
from geoprint.export.rapid.guard import RESIDENT as RESIDENT, check_resident as check_resident
from geoprint.export.rapid.language.symbols import Task as Task, read_task as read_task
from geoprint.export.rapid.made import Made as Made
from geoprint.export.rapid.program import proven_program as proven_program, rapid_program as rapid_program
from geoprint.export.rapid.settings import (
    Settings as Settings,
    StackSettings as StackSettings,
)
from geoprint.export.rapid.timeline import (
    Timeline as Timeline,
    check_timeline as check_timeline,
    timeline as timeline,
)
from geoprint.export.rapid.verify import (
    Judged as Judged,
    judge_program as judge_program,
    program_findings as program_findings,
    program_settings as program_settings,
    read_back as read_back,
)
from geoprint.export.rapid.verify_controller import controller_findings as controller_findings
from geoprint.export.switches import (
    CELL_MODULE as CELL_MODULE,
    STACK_MODULE as STACK_MODULE,
    as_new as as_new,
)
