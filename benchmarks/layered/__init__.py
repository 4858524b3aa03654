"""The layered paper's reduced-order experiments, measured here."""
