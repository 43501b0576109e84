// The AAR: Kotlin interface, libforesound.so for two ABIs, a prefab package with the C header, and licences; published as
// a Maven artifact. Kotlin comes with AGP 9; the native library with cargo-ndk, whose flags are made of ../../cargo-ndk.toml
// here, because cargo-ndk itself reads no such file.
plugins {
    alias(libs.plugins.android.library)
    `maven-publish`
}

val repository: File = rootDir.parentFile
// Version, licence and addresses have one place, [workspace.package] of Cargo.toml.
val cargoPackage: Map<String, String> = repository.resolve("Cargo.toml").readText()
    .substringAfter("[workspace.package]").substringBefore("\n[").lines()
    .filter { '=' in it && !it.startsWith('#') }
    .associate { it.substringBefore('=').trim() to it.substringAfter('=').trim().trim('"') }
group = "dev.foresound"
version = cargoPackage.getValue("version")
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
    // The library is in jniLibs, pages of 16 KiB and all; packed as it is.
    packaging { jniLibs.useLegacyPackaging = false }
    publishing {
        singleVariant("release") {
            withSourcesJar()
            withJavadocJar()
        }
    }
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

// The Android plugin makes prefab packages of its own native builds only, and ours is cargo's.
val prefabFolder: File = layout.buildDirectory.dir("prefab").get().asFile
val prefabPackage by tasks.registering(Exec::class) {
    description = "Writes the prefab package: the header, and the libraries by ABI."
    dependsOn(cargoNdk)
    workingDir = projectDir
    inputs.files("package/Prefab.java", repository.resolve("include"), repository.resolve(recipe.getValue("output")))
    outputs.dir(prefabFolder)
    // The Java that runs Gradle.
    commandLine(
        listOf(
            System.getProperty("java.home") + "/bin/java", "package/Prefab.java",
            prefabFolder.path, repository.resolve("include").path, repository.resolve(recipe.getValue("output")).path,
            cargoPackage.getValue("version"), recipe.getValue("platform"), libs.versions.ndk.get(),
        ),
    )
}

tasks.withType<Zip>().configureEach {
    if (name == "bundleReleaseAar" || name == "bundleDebugAar") {
        dependsOn(prefabPackage)
        from(prefabFolder) { into("prefab") }
        // Licences of everything inside, for an app's page of licences.
        from(repository.resolve("NOTICE")) { into("META-INF") }
    }
}

publishing {
    publications {
        register<MavenPublication>("release") {
            artifactId = "foresound"
            afterEvaluate { from(components["release"]) }
            pom {
                name = "Foresound"
                description = "Real-time ray-traced sound for Android: reflections, diffraction, moving doors and late reverb"
                url = cargoPackage.getValue("homepage")
                licenses {
                    license {
                        name = "MIT"
                        url = "https://spdx.org/licenses/MIT.html"
                    }
                    license {
                        name = "Apache-2.0"
                        url = "https://www.apache.org/licenses/LICENSE-2.0.txt"
                    }
                }
                developers { developer { name = "The Foresound authors" } }
                scm { url = cargoPackage.getValue("repository") }
            }
        }
    }
    // `android/gradlew -p android :foresound:publish` fills a folder that can be uploaded, or used as it is.
    repositories {
        maven {
            name = "folder"
            url = layout.buildDirectory.dir("maven").get().asFile.toURI()
        }
    }
}
