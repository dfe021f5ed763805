"""A project folder for a new arm: from answers, from a shipped arm, or from a URDF robot description."""
