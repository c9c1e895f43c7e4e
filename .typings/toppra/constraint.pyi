import enum

class ConstraintType(enum.Enum):
    Unknown = -1
    CanonicalLinear = 0
    CanonicalConic = 1
