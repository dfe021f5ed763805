"""Straight lines and arcs of the tool, and limits of its speed."""
