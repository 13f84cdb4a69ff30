"""A real arm as an evaluator: port, guard, states, and the same skill on top of them.

Nothing here is a safety function; docs/robot.md says what that means.
"""
