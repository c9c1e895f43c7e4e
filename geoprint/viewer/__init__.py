"""A live view of a result or a part: turned, replayed, questioned and drawn on in a browser, on this machine alone."""

from geoprint.viewer.live import notebook_scene as notebook_scene
from geoprint.viewer.loaded import (
    Motion as Motion,
    Viewed as Viewed,
    ViewedPlan as ViewedPlan,
    load_viewed as load_viewed,
)
