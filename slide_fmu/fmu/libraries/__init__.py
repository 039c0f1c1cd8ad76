"""The C runtime is compiled into libraries, which lie in folders of an FMU."""
