"""Waymo Open Motion: TFRecord files of Scenario messages, read without TensorFlow."""
