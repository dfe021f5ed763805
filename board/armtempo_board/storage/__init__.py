"""Records in the flash file system."""
