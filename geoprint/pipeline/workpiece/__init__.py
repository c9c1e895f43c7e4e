"""What is planned on: cell, part and body as read, cut, sided, placed and refined, and where distance is zero on it."""

from geoprint.pipeline.workpiece.layering import (
    EMPTY as EMPTY,
    Stack as Stack,
    even_stack as even_stack,
)
from geoprint.pipeline.workpiece.preparing import (
    SidedPart as SidedPart,
    largest_distance as largest_distance,
    prepare_workpiece as prepare_workpiece,
    read_part as read_part,
    read_stack as read_stack,
    sided_part as sided_part,
    surface_uncertainty as surface_uncertainty,
    with_rounds as with_rounds,
)
from geoprint.pipeline.workpiece.siding import (
    inverted_in_words as inverted_in_words,
    printed_side as printed_side,
    shape_in_words as shape_in_words,
)
