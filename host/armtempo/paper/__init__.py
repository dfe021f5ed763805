"""The paper repeated: every printed number next to the one found here."""
