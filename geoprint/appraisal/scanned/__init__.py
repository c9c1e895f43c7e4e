"""Scans of a print, or of the part before it: laid onto the part, and what they show, each with its uncertainty.

Stages on frozen values: `read_scan`, `registered`, then `measured_print` against a `PlannedDeposit`, or `lying_part`.
"""

from geoprint.appraisal.scanned.appraised import (
    AppraisedScan as AppraisedScan,
    LyingScan as LyingScan,
)
from geoprint.appraisal.scanned.deposit import (
    Deposited as Deposited,
    PlannedDeposit as PlannedDeposit,
)
from geoprint.appraisal.scanned.lying import (
    LyingPart as LyingPart,
    lying_part as lying_part,
)
from geoprint.appraisal.scanned.measuring import (
    BARE_RATIO as BARE_RATIO,
    COVERED_SHARE as COVERED_SHARE,
    MeasuredCells as MeasuredCells,
    MeasuredCrests as MeasuredCrests,
    MeasuredParts as MeasuredParts,
    MeasuredPrint as MeasuredPrint,
    measured_print as measured_print,
)
from geoprint.appraisal.scanned.reading import (
    Scan as Scan,
    is_scan as is_scan,
    read_scan as read_scan,
)
from geoprint.appraisal.scanned.registering import (
    Registration as Registration,
    registered as registered,
)
