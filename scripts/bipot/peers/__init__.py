"""A deck in other programs: CalculiX and GetFEM (scripts/compare)."""
