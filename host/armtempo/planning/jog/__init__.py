"""Motions by hand: joints and tool, as long as a button is held."""
