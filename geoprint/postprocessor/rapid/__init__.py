"""RAPID: written, read, executed and verified; what reads and executes shares no code with the writer."""

from geoprint.postprocessor.rapid.cell_module import check_cell as check_cell
from geoprint.postprocessor.rapid.controller_files import (
    CONTROLLER_FOLDER as CONTROLLER_FOLDER,
    controller_files as controller_files,
)
from geoprint.postprocessor.rapid.executed import Executed as Executed, Proof as Proof, check_times as check_times
from geoprint.postprocessor.rapid.expected import expected_events as expected_events
from geoprint.postprocessor.rapid.guard import RESIDENT as RESIDENT, check_resident as check_resident
from geoprint.postprocessor.rapid.language.symbols import read_task as read_task
from geoprint.postprocessor.rapid.made import Made as Made
from geoprint.postprocessor.rapid.program import proven_program as proven_program
from geoprint.postprocessor.rapid.settings import Settings as Settings, StackSettings as StackSettings
from geoprint.postprocessor.rapid.timeline import (
    Timeline as Timeline,
    check_timeline as check_timeline,
    timeline as timeline,
)
from geoprint.postprocessor.rapid.verify import (
    judge_program as judge_program,
    program_settings as program_settings,
    read_back as read_back,
)
from geoprint.postprocessor.rapid.verify_controller import controller_findings as controller_findings
from geoprint.postprocessor.switches import CELL_MODULE as CELL_MODULE, STACK_MODULE as STACK_MODULE, as_new as as_new
