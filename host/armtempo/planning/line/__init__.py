"""Straight lines and arcs of the tool, and speeds that it keeps."""
