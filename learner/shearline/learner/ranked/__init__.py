"""PSP whose partition ranks instead of gates, made of a model of reliability and one of cost.

``config`` holds its numbers, ``window`` the trials a fit looks at, ``reliability`` the chance of
success, ``cost`` what a success costs, ``score`` both as one number, ``elite`` where to draw
from, ``model`` all of them for one episode, ``ranked`` the learner.
"""
