// Nothing: a shared library wants one source of its own.
