"""Arm and motion records: conversion to the board's units and back."""
