# Shared by the scripts beside it; sourced, never run.
# shellcheck shell=bash

# The checkout, wherever the script was called from.
# shellcheck disable=SC2034 # for the scripts that source this
checkout=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

say() { printf '==> %s\n' "$*" >&2; }

die() {
    printf '%s: %s\n' "$(basename "$0")" "$*" >&2
    exit 1
}

# as_root WHY COMMAND...: as root, by sudo when we are not; WHY goes into the message when there is neither.
as_root() {
    local why=$1
    shift
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        # No terminal, no password prompt: fail at once instead of hanging an unattended run.
        if [ -t 0 ]; then sudo "$@"; else sudo -n "$@"; fi
    else
        die "$why needs root: run this as root, or install sudo"
    fi
}

# Installs those of the named Debian packages that are missing. Costs nothing when all are there.
need_packages() {
    local missing=() package
    for package in "$@"; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    say "installing ${missing[*]}"
    # A fresh machine has no package lists. An update that fails in part is no reason to stop while the
    # install works.
    as_root "apt-get update" env DEBIAN_FRONTEND=noninteractive apt-get update -qq >&2 ||
        say "apt-get update had errors; trying with the package lists there are"
    as_root "installing ${missing[*]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2 ||
        die "could not install ${missing[*]}; see apt-get's message above"
}
