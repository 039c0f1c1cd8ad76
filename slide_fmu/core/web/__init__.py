"""All pages of HTML share these colours, plots and charts, and this packing of files into one.

The JavaScript modules in ``modules`` are written by hand. Nothing here knows a surrogate, and no
page needs an internet connection.
"""
