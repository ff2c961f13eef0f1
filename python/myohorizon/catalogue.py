# SPDX-License-Identifier: Apache-2.0
"""Which plugins there are, and their options."""
import json

from ._library import check, encode, ffi, host, lib, new_error, taken_text


def _text(function, *arguments):
    error, out = new_error(), ffi.new("char **")
    check(function(host, *arguments, out, error), error)
    return taken_text(out[0])


def version():
    """Version of libmhe.so."""
    return ffi.string(lib.mhe_version()).decode()


def plugins():
    """All plugins that are found, and the files that were refused, as mhe-run --list-plugins --json tells."""
    return json.loads(_text(lib.mhe_plugins_list, lib.MHE_FORMAT_JSON))


def describe(id="config"):
    """A plugin with its options as a dict; "config": the keys of a configuration."""
    return json.loads(_text(lib.mhe_plugins_describe, encode(id), lib.MHE_FORMAT_JSON))
