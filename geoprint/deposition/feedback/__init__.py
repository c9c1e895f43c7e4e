"""What a print left along its runs, fed back: the flow of the next one, and when its valve opens and shuts.

Who measured is not asked: parts of runs with volume and deviation come in, a correction goes out. Nothing of the plants
in `silico`, on which it is tried, is known here.
"""

from geoprint.deposition.feedback.correcting import (
    Correction as Correction,
    FlowChange as FlowChange,
    corrected as corrected,
)
from geoprint.deposition.feedback.evidence import (
    SIGNIFICANT as SIGNIFICANT,
    VALVE_CAUSES as VALVE_CAUSES,
)
from geoprint.deposition.feedback.measured import (
    FlowBounds as FlowBounds,
    MeasuredRuns as MeasuredRuns,
    PrintedProgram as PrintedProgram,
    dispenser_of as dispenser_of,
)
