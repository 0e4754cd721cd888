# kpsa_room(<name> [FOLDERS f...] [PUBLIC l...] [PRIVATE l...]): the sources of this folder and of FOLDERS in it become one static library,
# kpsa_<name>. Headers are included from the project's root.
function(kpsa_room name)
  cmake_parse_arguments(PARSE_ARGV 1 room "" "" "FOLDERS;PUBLIC;PRIVATE")
  set(patterns *.cpp)
  foreach(folder ${room_FOLDERS})
    list(APPEND patterns ${folder}/*.cpp)
  endforeach()
  file(GLOB sources CONFIGURE_DEPENDS ${patterns})
  kpsa_library(${name} SOURCES ${sources} PUBLIC ${room_PUBLIC} PRIVATE ${room_PRIVATE})
endfunction()

# Rooms that read, write and report more than they compute, or of whose computing the sanitized tests do little. Without optimisation
# they compile in two fifths of the time, which a build that runs the tests once never gains back
set(KPSA_READERS files rig gltf scenes kpsa host report view cli)
# With a little of it in two thirds: these are as fast with that as with all (loading a rig, training), and share a precompiled header
set(KPSA_TALKERS rig host report view cli promise untouched growth)

# The same of a list of sources.
function(kpsa_library name)
  cmake_parse_arguments(PARSE_ARGV 1 room "" "" "SOURCES;PUBLIC;PRIVATE")
  add_library(kpsa_${name} STATIC ${room_SOURCES})
  target_include_directories(kpsa_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(kpsa_${name} PUBLIC ${room_PUBLIC} PRIVATE ${room_PRIVATE} kpsa_settings)
  if(KPSA_UNITY OR KPSA_COMPILE_ONCE)
    kpsa_compile_together(kpsa_${name} ${room_SOURCES})
  endif()
  if(KPSA_COMPILE_ONCE AND NOT KPSA_FUZZ AND name IN_LIST KPSA_READERS)  # fuzzers run for hours
    target_compile_options(kpsa_${name} PRIVATE -O0)
  elseif(name IN_LIST KPSA_TALKERS)
    target_compile_options(kpsa_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
endfunction()

function(kpsa_compile_together target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 40)
  foreach(source ${ARGN})
    file(STRINGS ${source} targets REGEX "foreach_target" LIMIT_COUNT 1)
    if(targets)  # they compile themselves once a target; and the longest ones had better run beside others
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()
