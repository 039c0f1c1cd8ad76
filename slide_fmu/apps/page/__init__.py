"""An FMU becomes a page: one HTML file that holds its surrogate and the runtime as WebAssembly.

The modules of JavaScript in ``web`` are written by hand. Nothing here trains, measures or needs
torch or exudyn, and nothing that a page does needs a network.
"""
