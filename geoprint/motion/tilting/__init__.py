"""Which direction of the part points up while which stretch of the deposit is printed; no kinematics is known here."""

from geoprint.motion.tilting.gathering import (
    Attitude as Attitude,
    attitudes_of as attitudes_of,
    gathered as gathered,
)
from geoprint.motion.tilting.ranges import Margins as Margins, UpRange as UpRange
from geoprint.motion.tilting.tilts import Tilts as Tilts, tilted as tilted
