"""The one error that a user sees: a line with the file or channel, the reason, and what to do."""


class Refused(Exception):
    pass


def listed(names, before="; there are ", most=20):
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return before + ", ".join(names[:most]) + more if names else ""
