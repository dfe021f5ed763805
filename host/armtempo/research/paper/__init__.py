"""The paper repeated: every printed number beside the one that comes out here."""
