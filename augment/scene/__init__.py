"""Traffic scenes: entities, the changes to them, and the graph of their lanes.

Frame: ego frame throughout (origin at the ego's geometric centre, x forward, y left), unless a
name says otherwise.
"""
