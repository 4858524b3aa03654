"""Quadrupeds that carry bars on ball joints, in full physics (Kim et al.)."""
