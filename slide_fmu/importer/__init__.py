"""This room imports FMUs of any tool: it reads, unpacks, instantiates and steps them.

fmpy loads their libraries. What the FMUs stand for is known elsewhere.
"""
