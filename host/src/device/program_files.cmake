# SPDX-License-Identifier: Apache-2.0
# toml++ is read as headers, in one source file only: nothing of it is linked or passed on to users of libsymrig.
find_path(SYMRIG_TOMLPLUSPLUS_DIR toml++/toml.h REQUIRED)

# Program files, device profiles, the compiler, the linter, timelines and receipts.
target_sources(symrig PRIVATE check_lines.cpp check_scan.cpp check_steps.cpp compile.cpp duration.cpp emit.cpp findings.cpp
  lint_rules.cpp lower.cpp moves.cpp profile.cpp profile_keys.cpp program_file.cpp rig_keys.cpp scan_keys.cpp step_keys.cpp
  table_reader.cpp timeline.cpp toml_tree.cpp board_json.cpp compare.cpp run.cpp run_json.cpp sim_rig.cpp symprog.cpp vcd.cpp
  wavedrom.cpp waveform.cpp)

# Device profiles: built into libsymrig, beside the built command, and installed, where users can read and change them.
file(GLOB profiles CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/host/profiles/*.toml)
list(SORT profiles)
list(LENGTH profiles profile_count)
set(profile_table "")
foreach(file IN LISTS profiles)
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  string(APPEND profile_table "    BuiltinProfile{\"${name}\", R\"toml(${text})toml\"},\n")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  configure_file(${file} ${PROJECT_BINARY_DIR}/host/share/symrig/profiles/${name}.toml COPYONLY)
endforeach()
configure_file(builtin_profiles.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/builtin_profiles.cpp @ONLY)
target_sources(symrig PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/builtin_profiles.cpp)
install(FILES ${profiles} DESTINATION ${CMAKE_INSTALL_DATADIR}/symrig/profiles)
