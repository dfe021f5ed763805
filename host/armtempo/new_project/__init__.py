"""A new project folder: arm file, first job, settings, and a page with the next commands."""

from armtempo.new_project.folder import write
from armtempo.new_project.geometry import from_joints, from_shipped, from_urdf

__all__ = ["from_joints", "from_shipped", "from_urdf", "write"]
