"""What a traffic scene is: entities, the changes to it, and the graph of its lanes.

Frame: ego frame throughout (origin at the ego's geometric centre, x forward, y left), unless a
name says otherwise.
"""
