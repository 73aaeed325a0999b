"""Contestants, endpoints and models."""
