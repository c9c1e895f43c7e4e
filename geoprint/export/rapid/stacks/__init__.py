"""The program of a whole stack of layers: written, read back, and executed beside the layers' own programs."""

from geoprint.export.rapid.stacks.running import StackProof as StackProof
from geoprint.export.rapid.stacks.together import together as together
from geoprint.export.rapid.stacks.verifying import (
    JudgedStack as JudgedStack,
    OwnProgram as OwnProgram,
    judge_stack as judge_stack,
    verify_stack as verify_stack,
)
from geoprint.export.rapid.stacks.writing import (
    LayerModules as LayerModules,
    stack_files as stack_files,
    stacked_layer as stacked_layer,
)
