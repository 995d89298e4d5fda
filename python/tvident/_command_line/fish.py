"""Completion in fish, whatever version of click is installed: the script of 8.4.0 and 8.4.1 fails, others cut descriptions at a comma."""

from __future__ import annotations

from click.shell_completion import CompletionItem, FishComplete

_SCRIPT = """\
function %(complete_func)s
    for line in (env %(complete_var)s=fish_complete COMP_WORDS=(commandline -cp | string collect) \
COMP_CWORD=(commandline -t) %(prog_name)s)
        set -l fields (string split \\t -- $line)
        switch $fields[1]
            case file
                __fish_complete_path $fields[2]
            case dir
                __fish_complete_directories $fields[2]
            case plain
                string join \\t -- $fields[2..]
        end
    end
end

complete --no-files --command %(prog_name)s --arguments "(%(complete_func)s)"
"""


class Fish(FishComplete):
    """Says each candidate on one line: what it is, the word, and what the word is for; between them tabs."""

    source_template = _SCRIPT

    def format_completion(self, item: CompletionItem) -> str:
        fields = (item.type, item.value, item.help or "")
        return "\t".join(" ".join(field.split()) for field in fields).rstrip("\t")
