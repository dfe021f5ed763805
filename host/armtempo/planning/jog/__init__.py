"""Jogging of joints and tool."""
