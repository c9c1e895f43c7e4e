"""Studies: many parts planned in many ways, on as many machines as there are, resumed after any stop."""

from geoprint.sweep.running import Outcome as Outcome
from geoprint.sweep.study import Study as Study, StudyCell as StudyCell, read_study as read_study
