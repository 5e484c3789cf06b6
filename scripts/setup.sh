# shellcheck shell=sh
# Shared by scripts/demo and scripts/test, which source it: what this machine lacks, and installing it.
#
# The scripts speak of *things* (compiler, driver, x11, wayland, xvfb, python, validation, ffmpeg). `lacks` guesses
# whether a thing is missing, `packages_for` knows its names in the package managers, `set_up` asks and installs before
# the long build. Whether there is an adapter only the program itself knows, and `require_adapter` asks it once it is
# built.

# Debian keeps ldconfig out of a user's PATH; a shell older than the Rust installation does not have cargo yet.
PATH="$PATH:/usr/sbin:/sbin:$HOME/.cargo/bin"
assume_yes=no

say() { printf '%s\n' "$*"; }

fail() {
    printf '%s\n' "$*" >&2
    exit 1
}

has() { command -v "$1" >/dev/null 2>&1; }

require_rust() { has cargo || fail "Rust is missing: see https://rustup.rs"; }

# Outside Linux the system itself brings a driver and windows.
lacks() {
    case $1:$(uname) in
        compiler:*) ! { has cc && has c++; } ;;
        driver:Linux) ! { has_libraries libvulkan.so.1 && has_vulkan_driver; } ;;
        x11:Linux) ! has_libraries libX11.so.6 libX11-xcb.so.1 libXcursor.so.1 libXi.so.6 libxkbcommon-x11.so.0 ;;
        wayland:Linux) ! has_libraries libwayland-client.so.0 libxkbcommon.so.0 ;;
        xvfb:Linux) ! { has Xvfb && has xdotool; } ;;
        python:Linux) ! { has_python python3 || has_python /usr/bin/python3; } ;;
        ffmpeg:*) ! { has ffmpeg && has ffprobe; } ;;
        validation:Linux) [ ! -e /usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json ] ;;
        *) return 1 ;;
    esac
}

# These are opened when the program runs; building needs none of them.
has_libraries() {
    known=$(ldconfig -p 2>/dev/null)
    for library; do
        case $known in *"$library "*) ;; *) return 1 ;; esac
    done
}

# Whether a Python has numpy, and can make an environment for other packages.
has_python() { "$1" -c 'import ensurepip, numpy, venv' 2>/dev/null; }

# Whether a driver is announced where the Vulkan loader looks.
has_vulkan_driver() {
    [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ] ||
        find "${XDG_DATA_HOME:-$HOME/.local/share}/vulkan" /etc/vulkan /etc/xdg/vulkan /usr/local/share/vulkan \
            /usr/share/vulkan -path '*/icd.d/*.json' 2>/dev/null | grep -q .
}

describe() {
    case $1 in
        compiler) say 'a C and a C++ compiler (Rust links with one, meshopt is built by the other)' ;;
        driver) say 'a Vulkan driver' ;;
        x11 | wayland) say 'the libraries that open a window' ;;
        xvfb) say 'Xvfb and xdotool (for the tests of the window)' ;;
        python) say 'Python with numpy and venv (for the tests of the map tools and of exported files)' ;;
        ffmpeg) say 'ffmpeg (it makes films of pictures)' ;;
        validation) say 'the Vulkan validation layer (for the tests of the renderer)' ;;
    esac
}

packages_for() {
    case $1:$2 in
        apt-get:compiler) say gcc g++ libc6-dev ;;
        apt-get:driver) say libvulkan1 mesa-vulkan-drivers ;;
        apt-get:x11) say libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 ;;
        apt-get:wayland) say libwayland-client0 libxkbcommon0 ;;
        apt-get:xvfb) say xvfb xdotool ;;
        apt-get:python) say python3 python3-numpy python3-venv ;;
        apt-get:validation) say vulkan-validationlayers ;;
        apt-get:ffmpeg) say ffmpeg ;;
        dnf:compiler) say gcc gcc-c++ ;;
        dnf:driver) say vulkan-loader mesa-vulkan-drivers ;;
        dnf:x11) say libX11 libX11-xcb libXcursor libXi libxkbcommon-x11 ;;
        dnf:wayland) say libwayland-client libxkbcommon ;;
        dnf:xvfb) say xorg-x11-server-Xvfb xdotool ;;
        dnf:python) say python3 python3-numpy ;;
        dnf:validation) say vulkan-validation-layers ;;
        dnf:ffmpeg) say ffmpeg-free ;;
        pacman:compiler) say gcc ;;
        pacman:driver) say vulkan-icd-loader vulkan-swrast ;;
        pacman:x11) say libx11 libxcursor libxi libxkbcommon-x11 ;;
        pacman:wayland) say wayland libxkbcommon ;;
        pacman:xvfb) say xorg-server-xvfb xdotool ;;
        pacman:python) say python python-numpy ;;
        pacman:validation) say vulkan-validation-layers ;;
        pacman:ffmpeg) say ffmpeg ;;
    esac
}

package_manager() {
    for manager in apt-get dnf pacman; do
        has $manager && say $manager && return
    done
}

# yes under --yes; asked on a terminal; else no.
agrees() {
    [ $assume_yes = yes ] && return
    [ -t 0 ] || return
    printf '%s [Y/n] ' "$1" >&2
    read -r answer || answer=n
    case $answer in '' | [Yy]*) ;; *) return 1 ;; esac
}

# install THING...: apt-get alone is run from here; otherwise says what to run, and returns 1.
install() {
    manager=$(package_manager)
    packages=$(for thing; do packages_for "$manager" "$thing"; done | paste -s -d ' ' -)
    case $manager in
        apt-get) by_hand="apt-get update && apt-get install $packages" ;;
        dnf) by_hand="dnf install $packages" ;;
        pacman) by_hand="pacman -S $packages" ;;
        *) say "Please install it in this system's own way." && return 1 ;;
    esac
    sudo=
    if [ "$(id -u)" -ne 0 ]; then
        sudo=sudo
        has sudo && by_hand="sudo sh -c '$by_hand'" || by_hand="su -c '$by_hand'"
    fi
    if [ "$manager" != apt-get ] || ! has "${sudo:-env}" || ! agrees "Install $packages with apt-get?"; then
        say "To install by hand: $by_hand"
        return 1
    fi
    say "Installing with apt-get: $packages"
    # A list that cannot be brought up to date (one broken source of many) need not matter.
    $sudo apt-get update -qq || say "apt-get update failed: going on with the lists there are."
    # shellcheck disable=SC2086 # packages is a list
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $packages
}

run_again="Then run $0 again. ($0 --yes installs without asking, where there is apt-get.)"

# set_up "THING ..." "THING ...": installs what is missing with a single question. Where that is not to be, goes on
# without the second list's things, and ends the script when one of the first list's is missing.
set_up() {
    missing=
    for thing in $1 $2; do
        if lacks "$thing"; then
            missing="$missing $thing"
            say "Missing here: $(describe "$thing")."
        fi
    done
    [ -n "$missing" ] || return 0
    # shellcheck disable=SC2086 # missing is a list
    install $missing && return
    for thing in $1; do
        lacks "$thing" && fail "$run_again"
    done
    say "Going on without."
}

# can_draw PROGRAM: its own answer (`info` ends with status 3 where there is no adapter).
can_draw() {
    status=0
    "$1" info >/dev/null 2>&1 || status=$?
    case $status in
        0) ;;
        3) return 1 ;;
        *) "$1" info || fail "$1 info ended with status $status." ;;
    esac
}

require_adapter() {
    can_draw "$1" && return
    say "Nothing to draw with: no graphics adapter. Mesa's software driver will do."
    install driver || fail "$run_again"
    can_draw "$1" || fail "Still no adapter:" "$("$1" info 2>&1)"
}

# Where cargo puts what it builds.
target_directory() {
    cargo metadata --format-version 1 --no-deps | sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p'
}

# The test programs that compare pictures, which must pass on other drivers and with other settings of drivers as well.
# shellcheck disable=SC2034 # for those that source this file
picture_tests="models pictures shading"

# test_arguments NAME...: for `cargo test`, to run those test programs alone.
test_arguments() { printf -- '--test %s ' "$@"; }
