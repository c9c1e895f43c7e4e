"""The camera of a photograph without fiducials: placed by the outline of the part in it, and by the printed lines."""

from geoprint.appraisal.outlined.lines import PrintedLines as PrintedLines
from geoprint.appraisal.outlined.picture_outline import (
    PictureOutline as PictureOutline,
    picture_outline as picture_outline,
)
from geoprint.appraisal.outlined.pose import camera_by_outline as camera_by_outline
