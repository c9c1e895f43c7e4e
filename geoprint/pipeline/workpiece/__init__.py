"""What is planned on: cell, part and body as read, cut, sided, placed and refined, and where distance is zero on it."""

from geoprint.pipeline.workpiece.preparing import (
    SidedPart as SidedPart,
    inverted_in_words as inverted_in_words,
    largest_distance as largest_distance,
    prepare_workpiece as prepare_workpiece,
    printed_side as printed_side,
    read_part as read_part,
    shape_in_words as shape_in_words,
    sided_part as sided_part,
    surface_uncertainty as surface_uncertainty,
    with_rounds as with_rounds,
)
