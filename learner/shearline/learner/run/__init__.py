"""One run on one host: the dispatcher's shell, where it meets clock, network and disk.

:func:`shearline.learner.run.serving.serve` puts the parts together. Data flows one way: network,
``inbox``, ``incoming``, ``owner`` (asks the dispatcher, writes the ``journal``), ``outgoing``; the
learner itself works in the ``fitter``'s thread.
"""
