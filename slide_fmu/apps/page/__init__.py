"""An FMU becomes a page: one HTML file that holds its surrogate and the runtime as WebAssembly.

The JavaScript modules in ``web`` are written by hand. Nothing here trains or measures, or needs
torch or exudyn, and a page needs no internet connection.
"""
