# What a machine needs before the project can be built, drawn and tested on it. Sourced by the scripts of tools/.
#
# Every function asks first whether a thing is there and is silent when it is, so that a second run does nothing and a
# machine without a network keeps working once it has everything.

# Runs apt-get as root, quietly; fails when that is not possible.
run_apt() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || return 1
        as_root=(sudo)
    fi
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq "$@" >/dev/null
}

# Installs Debian packages.
install_packages() {
    if ! command -v apt-get >/dev/null; then
        echo "apt-get is not here: please install $* yourself" >&2
        return 1
    fi
    echo "installing $*" >&2
    if ! run_apt install -y --no-install-recommends "$@" 2>/dev/null; then
        run_apt update && run_apt install -y --no-install-recommends "$@"
    fi
}

# need_command COMMAND PACKAGE...: installs the packages when the command is missing.
need_command() {
    local name=$1
    shift
    command -v "$name" >/dev/null || install_packages "$@"
}

# A Rust compiler, its tools and the web target, and a linker for it.
need_rust() {
    if ! command -v cargo >/dev/null && [ -x "$HOME/.cargo/bin/cargo" ]; then
        PATH="$HOME/.cargo/bin:$PATH"
    fi
    if ! command -v cargo >/dev/null; then
        echo "cargo is missing: install Rust from https://rustup.rs" >&2
        return 1
    fi
    need_command cc gcc libc6-dev
    # The decoder of meshes that meshoptimizer compressed is built from C++.
    need_command c++ g++
    command -v rustup >/dev/null || return 0
    # Without arguments rustup would rather install than say what is missing, so ask.
    if ! rustup target list --installed 2>/dev/null | grep -qx wasm32-unknown-unknown; then
        rustup --quiet target add wasm32-unknown-unknown
    fi
    local component
    for component in rustfmt clippy; do
        if ! rustup component list --installed 2>/dev/null | grep -q "^$component"; then
            rustup --quiet component add "$component"
        fi
    done
}

# A Vulkan driver; Mesa's software one does where there is no graphics hardware.
need_graphics() {
    if compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null; then
        return 0
    fi
    case "$(uname -s)" in
        Linux) install_packages mesa-vulkan-drivers libvulkan1 ;;
    esac
}

# A browser that draws without a display.
need_browser() {
    local name
    for name in chromium chromium-browser google-chrome; do
        command -v "$name" >/dev/null && return 0
    done
    install_packages chromium
}

# on_a_display COMMAND...: runs a command on a display that exists in memory alone, whose picture is in the file DISPLAY_PICTURE (XWD).
# Needs Xvfb.
on_a_display() {
    local folder server status=0
    folder=$(mktemp -d)
    temporary+=("$folder")
    Xvfb -displayfd 3 -screen 0 1280x1024x24 -nolisten tcp -fbdir "$folder" 3>"$folder/number" 2>/dev/null &
    server=$!
    until [ -s "$folder/number" ]; do
        kill -0 "$server" || return 1
        sleep 0.1
    done
    DISPLAY=:$(cat "$folder/number") DISPLAY_PICTURE=$folder/Xvfb_screen0 timeout 600 "$@" || status=$?
    kill "$server"
    wait "$server" || true
    return "$status"
}

# Folders that go when the script ends.
temporary=()
trap 'rm -rf "${temporary[@]}"' EXIT

# The graphics libraries complain without a place for run-time files.
if [ -z "${XDG_RUNTIME_DIR:-}" ]; then
    XDG_RUNTIME_DIR=$(mktemp -d)
    export XDG_RUNTIME_DIR
    temporary+=("$XDG_RUNTIME_DIR")
fi
