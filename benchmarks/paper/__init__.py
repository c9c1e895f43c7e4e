"""The paper's experiment: the three simulated prints of Table I, photographed, and compared as in Table II."""
