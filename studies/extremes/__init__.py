"""The matrix of extremes: its scenes, who judges and who confirms, the page."""
