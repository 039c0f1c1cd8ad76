"""What all pages of HTML share: colours, plots and charts, and how files are packed into one.

The modules of JavaScript in ``modules`` are written by hand. Nothing here knows a surrogate, and
no page needs a network.
"""
