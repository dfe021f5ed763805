"""Pages, plots and tables of plans and runs."""
