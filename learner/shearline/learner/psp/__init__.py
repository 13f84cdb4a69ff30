"""Parameter space partitioning (PSP), the paper's section 3, in its parts.

``config`` holds every choice the paper leaves open, ``reward`` the mean reward and the labels it
makes, ``proposal`` the Gaussian mixture, ``partition`` the filter as a port, ``machine``, ``trees``
and ``network`` what can stand in it, ``psp`` the learner that is made of them.
"""
