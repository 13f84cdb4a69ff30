"""Do the engines agree, and where they do not, which of them is right?

:mod:`.scenes` has the arm and the lock do the same on two plants; :mod:`.analytic` asks each engine
for what mechanics knows in closed form.
"""
