"""Studies: many parts planned in many ways, on as many machines as there are, resumed after any stop."""

from geoprint.sweep.report import distributions as distributions, save_study_page as save_study_page
from geoprint.sweep.running import (
    Outcome as Outcome,
    outcomes as outcomes,
    run_cell as run_cell,
    run_study as run_study,
)
from geoprint.sweep.study import Study as Study, StudyCell as StudyCell, read_study as read_study
from geoprint.sweep.tabulated import save_study_table as save_study_table
