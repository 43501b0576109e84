// The AAR: Kotlin face, libforesound.so for two ABIs, and a prefab package with the C header.
// Kotlin comes with AGP 9; the native library with cargo-ndk, whose flags are made of ../../cargo-ndk.toml here, because
// cargo-ndk itself reads no such file.
plugins {
    alias(libs.plugins.android.library)
}

val repository: File = rootDir.parentFile
val recipe: Map<String, String> = repository.resolve("cargo-ndk.toml").readLines()
    .map { it.substringBefore('#').trim() }
    .filter { '=' in it }
    .associate { it.substringBefore('=').trim() to it.substringAfter('=').trim().trim('"') }

fun list(key: String): List<String> =
    recipe.getValue(key).removeSurrounding("[", "]").split(',').map { it.trim().trim('"') }.filter { it.isNotEmpty() }

android {
    namespace = "dev.foresound"
    compileSdk = libs.versions.compileSdk.get().toInt()
    ndkVersion = libs.versions.ndk.get()
    defaultConfig {
        minSdk = libs.versions.minSdk.get().toInt()
        consumerProguardFiles("consumer-rules.pro")
        ndk { abiFilters += list("targets") }
    }
    buildFeatures { prefabPublishing = true }
    prefab {
        create("foresound") { headers = repository.resolve("include").path }
    }
    // The library is in jniLibs, pages of 16 KiB and all; packed as it is.
    packaging { jniLibs.useLegacyPackaging = false }
    publishing { singleVariant("release") { withSourcesJar() } }
    compileOptions {
        sourceCompatibility = JavaVersion.VERSION_17
        targetCompatibility = JavaVersion.VERSION_17
    }
}

dependencies {
    api(libs.coroutines.core)
    implementation(libs.coroutines.android)
}

check(recipe.getValue("platform").toInt() == libs.versions.minSdk.get().toInt()) {
    "cargo-ndk.toml builds for API ${recipe["platform"]}, the module says ${libs.versions.minSdk.get()}"
}

val cargoNdk by tasks.registering(Exec::class) {
    description = "Builds libforesound.so for every target of cargo-ndk.toml."
    workingDir = repository
    val sources = fileTree(repository) { include("src/**", "assets/hrtf/*.hrtf", "Cargo.toml", "Cargo.lock", "build.rs") }
    inputs.files(sources, repository.resolve("cargo-ndk.toml"))
    outputs.dir(repository.resolve(recipe.getValue("output")))
    environment("ANDROID_NDK_HOME", androidComponents.sdkComponents.ndkDirectory.get().asFile.path)
    commandLine(
        buildList {
            addAll(listOf("cargo", "ndk", "-P", recipe.getValue("platform"), "-o", recipe.getValue("output")))
            list("targets").forEach { addAll(listOf("-t", it)) }
            addAll(listOf("rustc", "--profile", recipe.getValue("profile"), "--locked", "--lib"))
            addAll(listOf("--crate-type", "cdylib", "--features", list("features").joinToString(",")))
            if (recipe.getValue("default-features") == "false") add("--no-default-features")
        },
    )
}

tasks.named("preBuild") { dependsOn(cargoNdk) }
