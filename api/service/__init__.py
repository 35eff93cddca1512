"""The REST service: routes by resource over experiment folders, jobs, rigs and accounts."""
