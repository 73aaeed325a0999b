"""Closed-loop drives: a planner drives a scene, traffic answers, and a score says how it went.

Pure: numpy and shapely. Frame: the ego frame of t0 (the Scene's), counter-clockwise, unless a
name says otherwise. Times are counted in steps of `STEP_S`. Letters in shapes: B proposals,
T moments, A objects, W ways. Sources: the facts about nuPlan's score, PDM-Closed and interPlan
in docs/simulation.md.
"""
