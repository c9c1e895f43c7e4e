"""The paper's experiment: the three prints of Table I in silico, photographed, and compared as in Table II."""
