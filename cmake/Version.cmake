# What `kpsa --version` says of this build: the commit, the compiler, the libraries. Read when the build is configured,
# which it is anew after every commit.
find_package(Git QUIET)
set(KPSA_COMMIT "no commit")
if(Git_FOUND AND EXISTS ${PROJECT_SOURCE_DIR}/.git)
  execute_process(COMMAND ${GIT_EXECUTABLE} -C ${PROJECT_SOURCE_DIR} describe --always --dirty --abbrev=10 OUTPUT_VARIABLE described
                  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(KPSA_COMMIT ${described})
  endif()
  if(EXISTS ${PROJECT_SOURCE_DIR}/.git/logs/HEAD)
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/.git/logs/HEAD)
  endif()
endif()
set(KPSA_LIBRARIES "Eigen ${Eigen3_VERSION}, TBB ${TBB_VERSION}, yaml-cpp ${yaml-cpp_VERSION}, tinygltf ${TinyGLTF_VERSION}, Draco ${draco_VERSION}, \
meshoptimizer ${meshoptimizer_VERSION}, libzip ${libzip_VERSION}, Embree ${embree_VERSION}, muParser ${muparser_VERSION}, Highway ${hwy_VERSION}, fmt ${fmt_VERSION}")
set_source_files_properties(version.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON COMPILE_DEFINITIONS
  "KPSA_VERSION=\"${PROJECT_VERSION}\";KPSA_COMMIT=\"${KPSA_COMMIT}\";KPSA_COMPILER=\"${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}\";KPSA_BUILD_TYPE=\"${CMAKE_BUILD_TYPE}\";KPSA_LIBRARIES=\"${KPSA_LIBRARIES}\"")
