"""OpenSCENARIO with its map in OpenDRIVE."""
