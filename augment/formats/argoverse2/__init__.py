"""Argoverse 2: the Sensor and the Motion Forecasting data set, which share their maps."""
