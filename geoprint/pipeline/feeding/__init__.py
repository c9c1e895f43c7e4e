"""Feedback in a plan: what a scan of the last print taught is held against the paths, and corrects flow and valve."""

from geoprint.pipeline.feeding.commanded import (
    printing_at as printing_at,
    with_feedback as with_feedback,
)
from geoprint.pipeline.feeding.printed import (
    check_single as check_single,
    feedback_text as feedback_text,
)
