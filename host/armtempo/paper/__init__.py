"""The paper's results repeated: each printed number compared with armtempo's."""
